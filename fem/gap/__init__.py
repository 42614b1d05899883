"""The gap between the flanks of all tooth pairs at one mesh position, before they deflect."""
