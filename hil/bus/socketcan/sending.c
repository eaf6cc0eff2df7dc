/*
 * What a program sends, looked at as the kernel does (net/can/raw.c): a frame has its size and at most eight bytes, the
 * socket is bound, or the address names an interface. Commands to a broadcast manager go to broadcast.c.
 *
 * A frame that is right costs no system call beside its own: the look at the descriptor comes only where it is wrong.
 */
#define _GNU_SOURCE
#include "broadcast.h"
#include "interfaces.h"
#include "isotp.h"
#include "real.h"
#include "sockets.h"

#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#define PASSES 0
#define LARGEST 4608 /* a command of CAN_BCM with all its frames, a message of CAN_ISOTP */

static int is_frame(const void *data, size_t size) {
    const struct can_frame *frame = data;
    return size == sizeof *frame && frame->can_dlc <= CAN_MAX_DLEN;
}

static ssize_t refuse(int error) {
    errno = error;
    return -1;
}

/* Whether a socket of the bus, bound or not, takes this; an error number where it does not. */
static int check(int fd, const struct can_socket *entry, const void *data, size_t size) {
    if (is_frame(data, size) && entry->connected) return PASSES;
    if (!socket_of(fd)) return PASSES; /* Not ours any more. */
    return is_frame(data, size) ? ENXIO : EINVAL;
}

/* Whether what is written is more than a frame: a command to a broadcast manager, a message of CAN_ISOTP. */
static int takes_more(int fd) {
    struct can_socket *entry = socket_remembered(fd);
    return entry && (entry->broadcast || entry->isotp) && socket_of(fd);
}

static ssize_t take_more(int fd, const struct can_socket *entry, const void *data, size_t size, int flags) {
    return entry->isotp ? isotp_write(fd, entry->isotp, data, size, flags) : broadcast_command(fd, data, size);
}

/* A packet to the hub. One that is gone is an interface that is down, and no reason to end the program by a signal. */
static ssize_t hand_over(int fd, const void *data, size_t size, int flags) {
    typedef ssize_t (*send_t)(int, const void *, size_t, int);
    ssize_t sent = REAL(send_t, "send")(fd, data, size, flags | MSG_NOSIGNAL);
    if (sent < 0 && errno == EPIPE) errno = ENETDOWN;
    return sent;
}

ssize_t write(int fd, const void *data, size_t size) {
    typedef ssize_t (*write_t)(int, const void *, size_t);
    struct can_socket *entry = socket_remembered(fd);
    if (entry && takes_more(fd)) return take_more(fd, entry, data, size, 0);
    int error = entry ? check(fd, entry, data, size) : PASSES;
    if (error) return refuse(error);
    ssize_t sent = entry ? hand_over(fd, data, size, 0) : -1;
    /* What is no socket any more was closed past us. */
    return entry && (sent >= 0 || errno != ENOTSOCK) ? sent : REAL(write_t, "write")(fd, data, size);
}

ssize_t send(int fd, const void *data, size_t size, int flags) {
    typedef ssize_t (*send_t)(int, const void *, size_t, int);
    struct can_socket *entry = socket_remembered(fd);
    if (entry && takes_more(fd)) return take_more(fd, entry, data, size, flags);
    int error = entry ? check(fd, entry, data, size) : PASSES;
    if (error) return refuse(error);
    return entry ? hand_over(fd, data, size, flags) : REAL(send_t, "send")(fd, data, size, flags);
}

/* A frame to an interface that the socket is not bound to: by a connection of its own. */
static ssize_t send_elsewhere(int interface, const void *data, size_t size) {
    typedef int (*socket_t)(int, int, int);
    int fd = REAL(socket_t, "socket")(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    if (fd < 0) return -1;
    ssize_t sent = socket_reach(fd, interface) < 0 ? -1 : transmit_packet(fd, data, size);
    int error = errno;
    close(fd);
    errno = error;
    return sent;
}

/* A frame to an address of CAN. */
static ssize_t send_to_address(int fd, const void *data, size_t size, int flags, const struct sockaddr_can *address,
                               socklen_t length) {
    struct can_socket *entry = socket_of(fd);
    int wanted = address->can_ifindex ? interface_of_index(address->can_ifindex) : entry->interface;
    if (length < (socklen_t)(offsetof(struct sockaddr_can, can_ifindex) + sizeof address->can_ifindex))
        return refuse(EINVAL);
    if (!is_frame(data, size)) return refuse(EINVAL);
    if (wanted < 0 || (!address->can_ifindex && !entry->connected)) return refuse(ENXIO);
    return entry->connected && wanted == entry->interface ? send(fd, data, size, flags)
                                                          : send_elsewhere(wanted, data, size);
}

ssize_t sendto(int fd, const void *data, size_t size, int flags, const struct sockaddr *address, socklen_t length) {
    typedef ssize_t (*sendto_t)(int, const void *, size_t, int, const struct sockaddr *, socklen_t);
    if (!socket_remembered(fd) || !socket_of(fd))
        return REAL(sendto_t, "sendto")(fd, data, size, flags, address, length);
    if (!address || socket_of(fd)->isotp) return send(fd, data, size, flags);
    if (address->sa_family != AF_CAN) return refuse(EINVAL);
    return send_to_address(fd, data, size, flags, (const struct sockaddr_can *)address, length);
}

/* The parts of a message one after the other; -1 with errno set where they are longer than any message here. */
static ssize_t gather(char *whole, const struct iovec *parts, size_t count) {
    size_t size = 0;
    for (size_t k = 0; k < count; k++) {
        if (size + parts[k].iov_len > LARGEST) return refuse(EINVAL);
        memcpy(whole + size, parts[k].iov_base, parts[k].iov_len);
        size += parts[k].iov_len;
    }
    return (ssize_t)size;
}

ssize_t sendmsg(int fd, const struct msghdr *message, int flags) {
    typedef ssize_t (*sendmsg_t)(int, const struct msghdr *, int);
    char whole[LARGEST] __attribute__((aligned(8)));
    if (!socket_remembered(fd) || !socket_of(fd)) return REAL(sendmsg_t, "sendmsg")(fd, message, flags);
    ssize_t size = gather(whole, message->msg_iov, message->msg_iovlen);
    return size < 0 ? -1 : sendto(fd, whole, (size_t)size, flags, message->msg_name, message->msg_namelen);
}

ssize_t writev(int fd, const struct iovec *parts, int count) {
    typedef ssize_t (*writev_t)(int, const struct iovec *, int);
    char whole[LARGEST] __attribute__((aligned(8)));
    if (!socket_remembered(fd) || !socket_of(fd) || count < 0) return REAL(writev_t, "writev")(fd, parts, count);
    ssize_t size = gather(whole, parts, (size_t)count);
    return size < 0 ? -1 : write(fd, whole, (size_t)size);
}
