"""Reading what strangers brought, in child processes with little memory and time."""
