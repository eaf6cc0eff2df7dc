"""`python -m quasiomni`."""

from quasiomni import main

main()
