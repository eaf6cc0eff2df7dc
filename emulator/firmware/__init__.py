"""Firmware of the emulated drives and encoders: CANopen (CiA 301), drive (CiA 402) and encoder (CiA 406) profiles."""
