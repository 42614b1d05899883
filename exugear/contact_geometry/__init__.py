"""The relative position of two gears: bodies of any kind in the frame of a contact, measures with their derivatives."""
