"""`python -m quasiomni`."""

from quasiomni.application import main

main()
