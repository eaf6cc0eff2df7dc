/*
 * Maps raw CAN sockets of an unmodified SocketCAN program onto the hub of a `unix:` bus: to be preloaded (ld.so(8)).
 *
 * QUASIOMNI_CAN=can0=/tmp/can0,can1=/tmp/can1 names the interfaces and their hubs. socket(AF_CAN, SOCK_RAW, CAN_RAW)
 * gives a SEQPACKET socket, bind() connects it to the hub of its interface. A packet is a struct can_frame, so read,
 * write, send, recv, select, poll and epoll are the system's own; only calls that know of addresses, interfaces and
 * CAN options pass through here. Filters are applied in the hub: a frame that does not pass wakes nobody up.
 *
 * A socket with SO_RXQ_OVFL gets packets of a frame and, once frames were dropped, their number, which recvmsg passes
 * on as the system does for a socket of its own. Its plain reads must ask for no more than a frame.
 *
 * In other files: which interfaces there are (interfaces.c), what is sent (sending.c) and received (receiving.c),
 * descriptors that come and go (descriptors.c), the sending half of CAN_BCM (broadcast.c), CAN_ISOTP (isotp.c).
 *
 * Not here: CAN FD, CAN_J1939, netlink. "any" (interface index 0) is the first interface.
 */
#define _GNU_SOURCE
#include "interfaces.h"
#include "isotp.h"
#include "real.h"
#include "sockets.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/isotp.h>
#include <linux/can/raw.h>
#include <poll.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define SOCKETS 4096
#define OWN_FRAMES 1u
#define JOIN_FILTERS 2u
#define ACKNOWLEDGE 4u
#define ACKNOWLEDGE_TIMEOUT_MS 20000

static struct can_socket *sockets[SOCKETS];

struct can_socket *socket_remembered(int fd) { return fd >= 0 && fd < SOCKETS ? sockets[fd] : NULL; }

void socket_share(int from, int to) {
    if (to >= SOCKETS) return;
    sockets[to] = sockets[from];
    sockets[to]->references++;
}

int socket_release(int fd) {
    struct can_socket *entry = sockets[fd];
    sockets[fd] = NULL;
    if (--entry->references == 0) {
        free(entry);
        return -1;
    }
    for (int other = 0; other < SOCKETS; other++)
        if (sockets[other] == entry) return other;
    return -1;
}

struct can_socket *socket_of(int fd) {
    if (!socket_remembered(fd)) return NULL;
    int domain = 0, type = 0;
    socklen_t size = sizeof domain;
    typedef int (*getsockopt_t)(int, int, int, void *, socklen_t *);
    getsockopt_t real = REAL(getsockopt_t, "getsockopt");
    if (real(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) == 0 && domain == AF_UNIX) {
        size = sizeof type;
        if (real(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_SEQPACKET) return sockets[fd];
    }
    socket_release(fd);
    return NULL;
}

ssize_t transmit_packet(int fd, const void *data, size_t size) {
    typedef ssize_t (*sendto_t)(int, const void *, size_t, int, const struct sockaddr *, socklen_t);
    return REAL(sendto_t, "sendto")(fd, data, size, MSG_NOSIGNAL, NULL, 0);
}

static int tell(int fd, struct can_socket *entry) {
    size_t size = offsetof(struct hello, filters) + entry->count * sizeof(struct can_filter);
    return transmit_packet(fd, &entry->hello, size) < 0 ? -1 : 0;
}

int socket(int domain, int type, int protocol) {
    typedef int (*socket_t)(int, int, int);
    socket_t real = REAL(socket_t, "socket");
    int flags = type & (SOCK_CLOEXEC | SOCK_NONBLOCK);
    int raw = (type & ~flags) == SOCK_RAW && protocol == CAN_RAW;
    int broadcast = (type & ~flags) == SOCK_DGRAM && protocol == CAN_BCM;
    int messages = (type & ~flags) == SOCK_DGRAM && protocol == CAN_ISOTP;
    struct isotp *isotp = NULL;
    if (domain != PF_CAN || interfaces_known() == 0) return real(domain, type, protocol);
    if (!raw && !broadcast && !messages) {
        errno = EPROTONOSUPPORT; /* As a kernel without the module: CAN_J1939. */
        return -1;
    }
    int fd = messages ? isotp_open(flags, &isotp) : real(AF_UNIX, SOCK_SEQPACKET | flags, 0);
    if (fd < 0) return fd;
    struct can_socket *entry = fd < SOCKETS ? calloc(1, sizeof *entry) : NULL;
    if (!entry) {
        close(fd);
        errno = fd < SOCKETS ? ENOMEM : EMFILE;
        return -1;
    }
    if (sockets[fd]) socket_release(fd);
    entry->references = 1;
    entry->broadcast = broadcast;
    entry->isotp = isotp;
    entry->count = raw ? 1 : 0; /* One filter of zeros: everything, as the kernel has it. */
    entry->hello.magic = HELLO_MAGIC;
    sockets[fd] = entry;
    return fd;
}

/* Waits until the hub knows of the socket: what is sent after bind() must arrive, and its answer is no frame. */
static int await_acknowledgement(int fd) {
    struct pollfd waiting = {.fd = fd, .events = POLLIN};
    uint32_t answer;
    if (poll(&waiting, 1, ACKNOWLEDGE_TIMEOUT_MS) == 1 && recv(fd, &answer, sizeof answer, 0) > 0) return 0;
    errno = ENETDOWN;
    return -1;
}

int socket_reach(int fd, int interface) {
    typedef int (*connect_t)(int, const struct sockaddr *, socklen_t);
    struct sockaddr_un hub = {.sun_family = AF_UNIX};
    if (interface < 0) {
        errno = ENODEV;
        return -1;
    }
    strncpy(hub.sun_path, interface_path(interface), sizeof hub.sun_path - 1);
    if (REAL(connect_t, "connect")(fd, (struct sockaddr *)&hub, sizeof hub) == 0) return 0;
    errno = ENETDOWN;
    return -1;
}

int socket_join(int fd, struct can_socket *entry, const struct sockaddr_can *wanted) {
    int chosen = wanted->can_ifindex ? interface_of_index(wanted->can_ifindex) : 0;
    if (socket_reach(fd, chosen) < 0) return -1;
    entry->interface = chosen;
    entry->connected = 1;
    entry->hello.flags |= ACKNOWLEDGE;
    if (tell(fd, entry) < 0) return -1;
    entry->hello.flags &= ~ACKNOWLEDGE;
    return await_acknowledgement(fd);
}

int bind(int fd, const struct sockaddr *address, socklen_t length) {
    typedef int (*bind_t)(int, const struct sockaddr *, socklen_t);
    struct can_socket *entry = socket_of(fd);
    if (!entry || address->sa_family != AF_CAN) return REAL(bind_t, "bind")(fd, address, length);
    if (entry->isotp) return isotp_bind(entry->isotp, (const struct sockaddr_can *)address, length);
    return socket_join(fd, entry, (const struct sockaddr_can *)address);
}

int connect(int fd, const struct sockaddr *address, socklen_t length) {
    typedef int (*connect_t)(int, const struct sockaddr *, socklen_t);
    struct can_socket *entry = address && address->sa_family == AF_CAN ? socket_of(fd) : NULL;
    if (!entry) return REAL(connect_t, "connect")(fd, address, length);
    if (entry->isotp) {
        errno = EOPNOTSUPP; /* Its two identifiers are given to bind(). */
        return -1;
    }
    return socket_join(fd, entry, (const struct sockaddr_can *)address);
}

void socket_tell_address(const struct can_socket *entry, void *address, socklen_t *length) {
    struct sockaddr_can sender = {.can_family = AF_CAN, .can_ifindex = interface_index(entry->interface)};
    if (!address || !length) return;
    if (entry->isotp) sender = *isotp_address(entry->isotp);
    memcpy(address, &sender, *length < sizeof sender ? *length : sizeof sender);
    *length = sizeof sender;
}

int getsockname(int fd, struct sockaddr *address, socklen_t *length) {
    typedef int (*getsockname_t)(int, struct sockaddr *, socklen_t *);
    struct can_socket *entry = socket_of(fd);
    if (!entry) return REAL(getsockname_t, "getsockname")(fd, address, length);
    socket_tell_address(entry, address, length);
    return 0;
}

static int set_flag(struct can_socket *entry, uint32_t flag, const void *value, socklen_t size) {
    int wanted = 0;
    if (size != sizeof wanted) return EINVAL;
    memcpy(&wanted, value, sizeof wanted);
    entry->hello.flags = wanted ? entry->hello.flags | flag : entry->hello.flags & ~flag;
    return 0;
}

static int set_filters(struct can_socket *entry, const void *value, socklen_t size) {
    if (size % sizeof(struct can_filter) || size > sizeof entry->hello.filters) return EINVAL;
    memcpy(entry->hello.filters, value, size);
    entry->count = size / sizeof(struct can_filter);
    return 0;
}

static int set_option(struct can_socket *entry, int name, const void *value, socklen_t size) {
    switch (name) {
    case CAN_RAW_FILTER: return set_filters(entry, value, size);
    case CAN_RAW_RECV_OWN_MSGS: return set_flag(entry, OWN_FRAMES, value, size);
    case CAN_RAW_JOIN_FILTERS: return set_flag(entry, JOIN_FILTERS, value, size);
    case CAN_RAW_LOOPBACK: return 0; /* The hub is the bus: everybody else hears a frame. */
    case CAN_RAW_FD_FRAMES: return 0; /* Allowed, as on an interface without CAN FD: none ever come. */
    case CAN_RAW_ERR_FILTER:
        if (size != sizeof entry->hello.error_mask) return EINVAL;
        memcpy(&entry->hello.error_mask, value, size);
        return 0;
    default: return ENOPROTOOPT;
    }
}

int setsockopt(int fd, int level, int name, const void *value, socklen_t size) {
    typedef int (*setsockopt_t)(int, int, int, const void *, socklen_t);
    int drops = level == SOL_SOCKET && name == SO_RXQ_OVFL, messages = level == SOL_CAN_ISOTP;
    struct can_socket *entry = level == SOL_CAN_RAW || drops || messages ? socket_of(fd) : NULL;
    if (!entry) return REAL(setsockopt_t, "setsockopt")(fd, level, name, value, size);
    int error = ENOPROTOOPT;
    if (drops) error = set_flag(entry, DROPS, value, size);
    else if (messages && entry->isotp) error = isotp_set(entry->isotp, name, value, size);
    else if (!messages && !entry->isotp) error = set_option(entry, name, value, size);
    if (error) {
        errno = error;
        return -1;
    }
    return entry->connected ? tell(fd, entry) : 0;
}

static int copy_out(void *value, socklen_t *size, const void *from, size_t length) {
    if (*size < length) {
        errno = ERANGE;
        return -1;
    }
    memcpy(value, from, length);
    *size = length;
    return 0;
}

int getsockopt(int fd, int level, int name, void *value, socklen_t *size) {
    typedef int (*getsockopt_t)(int, int, int, void *, socklen_t *);
    int can = level == SOL_CAN_RAW || level == SOL_CAN_ISOTP;
    struct can_socket *entry = can || level == SOL_SOCKET ? socket_of(fd) : NULL;
    int answer = 0;
    if (entry && level == SOL_SOCKET && (name == SO_DOMAIN || name == SO_TYPE || name == SO_PROTOCOL)) {
        int type = entry->broadcast || entry->isotp ? SOCK_DGRAM : SOCK_RAW;
        int protocol = entry->broadcast ? CAN_BCM : entry->isotp ? CAN_ISOTP : CAN_RAW;
        answer = name == SO_DOMAIN ? AF_CAN : name == SO_TYPE ? type : protocol;
        return copy_out(value, size, &answer, sizeof answer);
    }
    if (entry && level == SOL_SOCKET && name == SO_RXQ_OVFL) {
        answer = (entry->hello.flags & DROPS) != 0;
        return copy_out(value, size, &answer, sizeof answer);
    }
    if (entry && can && (level == SOL_CAN_ISOTP || entry->isotp)) {
        errno = level == SOL_CAN_ISOTP && entry->isotp ? isotp_get(entry->isotp, name, value, size) : ENOPROTOOPT;
        return errno ? -1 : 0;
    }
    if (!entry || level != SOL_CAN_RAW) return REAL(getsockopt_t, "getsockopt")(fd, level, name, value, size);
    switch (name) {
    case CAN_RAW_FILTER:
        return copy_out(value, size, entry->hello.filters, entry->count * sizeof(struct can_filter));
    case CAN_RAW_ERR_FILTER: return copy_out(value, size, &entry->hello.error_mask, sizeof answer);
    case CAN_RAW_RECV_OWN_MSGS: answer = (entry->hello.flags & OWN_FRAMES) != 0; break;
    case CAN_RAW_JOIN_FILTERS: answer = (entry->hello.flags & JOIN_FILTERS) != 0; break;
    case CAN_RAW_LOOPBACK: answer = 1; break;
    case CAN_RAW_FD_FRAMES: break;
    default: errno = ENOPROTOOPT; return -1;
    }
    return copy_out(value, size, &answer, sizeof answer);
}

int ioctl(int fd, unsigned long request, ...) {
    typedef int (*ioctl_t)(int, unsigned long, void *);
    va_list arguments;
    va_start(arguments, request);
    void *argument = va_arg(arguments, void *);
    va_end(arguments);
    int answer = interface_ioctl(request, argument);
    return answer <= 0 ? answer : REAL(ioctl_t, "ioctl")(fd, request, argument);
}
