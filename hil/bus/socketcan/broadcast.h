/* The sending half of CAN_BCM: frames repeated by a timer, without the program. */
#ifndef QUASIOMNI_BROADCAST_H
#define QUASIOMNI_BROADCAST_H

#include <stddef.h>
#include <sys/types.h>

/* Carries out a message that was written to a broadcast manager's socket; its size, or -1 with errno set. */
ssize_t broadcast_command(int fd, const void *message, size_t size);

/* Forgets all that a socket has set up. */
void broadcast_close(int fd);

/* A descriptor is closed, and another one of the same socket stays. */
void broadcast_move(int fd, int other);

#endif
