"""The one folder that holds everything people bring and make; nobody else knows how it is laid out."""
