"""Things with a head or wheels on the floor and a long way up to the hands: swept, pulled, pushed."""
