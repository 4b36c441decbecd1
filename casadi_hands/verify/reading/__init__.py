"""Readers of a folder's files."""
