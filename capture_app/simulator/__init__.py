"""A phone that records a known motion: sessions for demonstrations, tests and measurements."""
