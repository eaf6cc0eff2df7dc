"""Videos of the emulated vehicle: what is seen is noted while it drives, and drawn afterwards."""
