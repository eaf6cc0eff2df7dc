/*
 * What a program receives: the address of a frame, whether it is the program's own, and how many frames were dropped
 * before it.
 */
#define _GNU_SOURCE
#include "real.h"
#include "sockets.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#define OWN_MARK 1

/* Whether a frame is the receiver's own, as the hub has marked it; the mark is taken away. */
static int take_mark(const struct can_socket *entry, void *data, ssize_t received) {
    struct can_frame *frame = data;
    if (entry->isotp || received != (ssize_t)sizeof *frame || frame->__pad != OWN_MARK) return 0;
    frame->__pad = 0;
    return 1;
}

ssize_t recvfrom(int fd, void *data, size_t size, int flags, struct sockaddr *address, socklen_t *length) {
    typedef ssize_t (*recvfrom_t)(int, void *, size_t, int, struct sockaddr *, socklen_t *);
    recvfrom_t real = REAL(recvfrom_t, "recvfrom");
    struct can_socket *entry = socket_of(fd);
    if (!entry) return real(fd, data, size, flags, address, length);
    ssize_t received = real(fd, data, size, flags, NULL, NULL);
    if (received >= 0) socket_tell_address(entry, address, length);
    take_mark(entry, data, received);
    return received;
}

ssize_t __recvfrom_chk(int fd, void *data, size_t size, size_t room, int flags, struct sockaddr *address,
                       socklen_t *length) {
    if (size > room) abort();
    return recvfrom(fd, data, size, flags, address, length);
}

/* Puts a number of dropped frames behind the control messages of a message, as the system does for SO_RXQ_OVFL. */
static void add_drops(struct msghdr *message, size_t room, uint32_t dropped) {
    size_t used = message->msg_control ? message->msg_controllen : 0;
    if (!message->msg_control || used + CMSG_SPACE(sizeof dropped) > room) {
        message->msg_flags |= MSG_CTRUNC;
        return;
    }
    struct cmsghdr *control = (struct cmsghdr *)((char *)message->msg_control + used);
    memset(control, 0, CMSG_SPACE(sizeof dropped));
    control->cmsg_level = SOL_SOCKET;
    control->cmsg_type = SO_RXQ_OVFL;
    control->cmsg_len = CMSG_LEN(sizeof dropped);
    memcpy(CMSG_DATA(control), &dropped, sizeof dropped);
    message->msg_controllen = used + CMSG_SPACE(sizeof dropped);
}

/* A frame into the caller's memory, and the number of dropped frames that may follow it into its control messages. */
static ssize_t receive_with_drops(int fd, struct msghdr *message, int flags) {
    typedef ssize_t (*recvmsg_t)(int, struct msghdr *, int);
    uint32_t dropped = 0;
    size_t room = message->msg_controllen;
    struct iovec *asked = message->msg_iov;
    struct iovec parts[2] = {{.iov_base = asked->iov_base, .iov_len = sizeof(struct can_frame)},
                             {.iov_base = &dropped, .iov_len = sizeof dropped}};
    message->msg_iov = parts;
    message->msg_iovlen = 2;
    ssize_t received = REAL(recvmsg_t, "recvmsg")(fd, message, flags);
    message->msg_iov = asked;
    message->msg_iovlen = 1;
    if (received <= (ssize_t)sizeof(struct can_frame)) return received;
    add_drops(message, room, dropped);
    return sizeof(struct can_frame);
}

static int wants_drops(const struct can_socket *entry, const struct msghdr *message) {
    return !entry->isotp && entry->hello.flags & DROPS && message->msg_iovlen == 1 &&
           message->msg_iov->iov_len >= sizeof(struct can_frame);
}

ssize_t recvmsg(int fd, struct msghdr *message, int flags) {
    typedef ssize_t (*recvmsg_t)(int, struct msghdr *, int);
    recvmsg_t real = REAL(recvmsg_t, "recvmsg");
    struct can_socket *entry = socket_of(fd);
    if (!entry) return real(fd, message, flags);
    void *address = message->msg_name;
    socklen_t length = message->msg_namelen;
    message->msg_name = NULL;
    message->msg_namelen = 0;
    int with_drops = wants_drops(entry, message);
    ssize_t received = with_drops ? receive_with_drops(fd, message, flags) : real(fd, message, flags);
    message->msg_name = address;
    if (received < 0) {
        message->msg_namelen = length;
        return received;
    }
    socket_tell_address(entry, address, &length);
    message->msg_namelen = address ? length : 0;
    if (message->msg_iovlen == 1 && take_mark(entry, message->msg_iov[0].iov_base, received))
        message->msg_flags |= MSG_CONFIRM | MSG_DONTROUTE;
    return received;
}
