"""The `omocap` command, one module per subcommand."""
