"""A page in the browser on which one watches an emulated vehicle, breaks something, and stops it.

The page is served by a process of its own (`serving`), which only learns what `Snapshot` says; the loop that moves the
vehicle looks at it some 25 times a second (`watch`), sends what it saw without ever waiting, and takes what people ask.
"""
