"""Where two gears stand to each other: bodies of any kind in the frame of a contact, relative position, reference."""
