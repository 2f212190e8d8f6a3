"""The local web server: the library it keeps, its guards, and its HTTP API."""
