"""Base motions made to measure: a sampled root path, and a body that walks or shuffles along it."""
