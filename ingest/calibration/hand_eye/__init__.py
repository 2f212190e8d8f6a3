"""One motion seen twice, by the phone and by another tracker of the object: AX = XB and AX = ZB."""
