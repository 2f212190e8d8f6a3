"""The paper's tables: methods run over windows, measured, and set beside the published numbers."""
