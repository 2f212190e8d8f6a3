"""The perceptual study: pairs of films shown to raters, their votes, and what they say."""
