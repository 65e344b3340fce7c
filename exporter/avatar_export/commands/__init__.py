"""The commands of avatar-export: arguments in, one library call, printing."""
