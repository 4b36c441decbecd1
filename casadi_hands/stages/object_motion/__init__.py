"""What the floating and the whole-hand stage share: the object's motion, contacts and forces."""
