"""The page that shows a design."""
