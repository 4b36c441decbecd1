"""Statics in numbers: grasp maps, friction cones, and programmes over forces in them."""
