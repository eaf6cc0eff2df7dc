/* CAN_ISOTP: messages of up to 4095 bytes in frames (ISO 15765-2), each socket with a thread of its own. */
#ifndef QUASIOMNI_ISOTP_H
#define QUASIOMNI_ISOTP_H

#include <linux/can.h>
#include <stddef.h>
#include <sys/socket.h>
#include <sys/types.h>

struct isotp;

/* A socket that is not bound yet: its descriptor, or -1 with errno set. */
int isotp_open(int flags, struct isotp **made);

/* Binds it to an interface and two identifiers; 0, or -1 with errno set. */
int isotp_bind(struct isotp *socket, const struct sockaddr_can *address, socklen_t length);

/* Its address, empty until it is bound. */
const struct sockaddr_can *isotp_address(const struct isotp *socket);

/* An option written, or read; an error number. */
int isotp_set(struct isotp *socket, int name, const void *value, socklen_t size);
int isotp_get(const struct isotp *socket, int name, void *value, socklen_t *size);

/* Hands a message over to be sent; its size, or -1 with errno set. */
ssize_t isotp_write(int fd, struct isotp *socket, const void *message, size_t size, int flags);

/* Before its last descriptor is closed: waits until everything is sent. */
void isotp_close(int fd, struct isotp *socket);

#endif
