"""Where fingers should touch, seen from the task alone: statics, reach and room at the goals; nothing is optimised."""
