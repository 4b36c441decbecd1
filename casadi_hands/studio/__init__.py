"""The studio: a page on this machine in which a task is made, checked, solved and seen."""
