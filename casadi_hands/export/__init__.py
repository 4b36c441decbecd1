"""A design as files: URDF, MJCF, the motion's arrays, the result's JSON, and the folder that holds them."""
