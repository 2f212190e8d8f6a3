"""Selection: which of many palm hypotheses are kept, and which of K finished samples is shown."""
