"""What can be asked for: one model for each command, which command line, jobs, HTTP and tables share."""
