"""Whether the files of a folder say the same, and what the task asked for."""
