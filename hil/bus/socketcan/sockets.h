/* The CAN sockets of the program, by their descriptors. */
#ifndef QUASIOMNI_SOCKETS_H
#define QUASIOMNI_SOCKETS_H

#include <linux/can.h>
#include <linux/can/raw.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/types.h>

#define HELLO_MAGIC 0x4e414351u /* "QCAN" */
#define DROPS 16u               /* a flag of it: packets tell how many frames were dropped before them */

/* What a client tells the hub, when it connects and whenever it changes; the filters follow. 12 + 8 n bytes. */
struct hello {
    uint32_t magic;
    uint32_t error_mask;
    uint32_t flags;
    struct can_filter filters[CAN_RAW_FILTER_MAX];
};

struct isotp;

struct can_socket {
    int references;      /* descriptors: dup() and its like make more of them */
    int broadcast;       /* CAN_BCM instead of CAN_RAW */
    struct isotp *isotp; /* CAN_ISOTP instead of CAN_RAW, else NULL */
    int connected;
    int interface;
    unsigned count;
    struct hello hello;
};

/* What a descriptor was made for; it may have been closed past us since. */
struct can_socket *socket_remembered(int fd);

/* The entry of a descriptor that is still the socket it was made for. */
struct can_socket *socket_of(int fd);

/* Another descriptor of a socket; one descriptor less, with another one of the same socket or -1. */
void socket_share(int from, int to);
int socket_release(int fd);

/* Connects a descriptor to the hub of an interface; -1 with errno set. */
int socket_reach(int fd, int interface);

/* Connects a descriptor to the hub of the interface in an address, with the filters of an entry; -1 with errno set. */
int socket_join(int fd, struct can_socket *entry, const struct sockaddr_can *wanted);

/* Writes the address of a socket where a program has room for it. */
void socket_tell_address(const struct can_socket *entry, void *address, socklen_t *length);

/* Sends a packet as it is, whatever send and write make of it. */
ssize_t transmit_packet(int fd, const void *data, size_t size);

#endif
