"""Method drawing: a holder whose drawing says where the phone is on the object."""
