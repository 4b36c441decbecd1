"""The page on which a design is looked at in a browser."""
