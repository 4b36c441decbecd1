"""Design a robot hand for a task: its topology, its shape, its motion and its forces."""

__version__ = "0.1.0"
