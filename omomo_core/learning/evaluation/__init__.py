"""Measuring generated motion against recorded people who moved objects."""
