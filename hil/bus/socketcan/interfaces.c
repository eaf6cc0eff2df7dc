/*
 * The interfaces of QUASIOMNI_CAN=can0=/tmp/can0,can1=/tmp/can1, wherever a program looks for interfaces: by name and
 * index, in the lists of if_nameindex and getifaddrs, by ioctl, and in /proc/net/dev (psutil, ifconfig).
 */
#define _GNU_SOURCE
#include "interfaces.h"

#include "real.h"

#include <errno.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <linux/can.h>
#include <linux/if_packet.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define INTERFACES 16
#define FIRST_INDEX 1001
#define FLAGS (IFF_UP | IFF_RUNNING | IFF_NOARP)
#define COUNTERS "/proc/net/dev"

struct interface {
    char name[IFNAMSIZ];
    char path[sizeof(((struct sockaddr_un *)0)->sun_path)];
};

static struct interface interfaces[INTERFACES];
static int interface_count;

__attribute__((constructor)) static void read_interfaces(void) {
    const char *text = getenv("QUASIOMNI_CAN");
    while (text && *text && interface_count < INTERFACES) {
        const char *equals = strchr(text, '='), *end = strchr(text, ',');
        struct interface *found = &interfaces[interface_count];
        size_t whole = end ? (size_t)(end - text) : strlen(text);
        if (equals && equals < text + whole) {
            size_t name = (size_t)(equals - text), path = whole - name - 1;
            if (name > 0 && name < sizeof found->name && path > 0 && path < sizeof found->path) {
                memcpy(found->name, text, name);
                memcpy(found->path, equals + 1, path);
                interface_count++;
            }
        }
        text += whole + (end ? 1 : 0);
    }
}

int interfaces_known(void) { return interface_count; }

int interface_of_name(const char *name) {
    for (int k = 0; k < interface_count; k++)
        if (strncmp(interfaces[k].name, name, IFNAMSIZ) == 0) return k;
    return -1;
}

int interface_of_index(int index) {
    int k = index - FIRST_INDEX;
    return k >= 0 && k < interface_count ? k : -1;
}

int interface_index(int number) { return FIRST_INDEX + number; }

const char *interface_path(int number) { return interfaces[number].path; }

int interface_ioctl(unsigned long request, void *argument) {
    struct ifreq *asked = argument;
    int known = request == SIOCGIFNAME || request == SIOCGIFINDEX || request == SIOCGIFFLAGS ||
                request == SIOCGIFMTU || request == SIOCGIFHWADDR || request == SIOCGIFTXQLEN || request == SIOCETHTOOL;
    if (!known || !asked) return 1;
    int k = request == SIOCGIFNAME ? interface_of_index(asked->ifr_ifindex) : interface_of_name(asked->ifr_name);
    if (k < 0) return 1;
    switch (request) {
    case SIOCGIFNAME: memcpy(asked->ifr_name, interfaces[k].name, IFNAMSIZ); return 0;
    case SIOCGIFINDEX: asked->ifr_ifindex = FIRST_INDEX + k; return 0;
    case SIOCGIFFLAGS: asked->ifr_flags = FLAGS; return 0;
    case SIOCGIFMTU: asked->ifr_mtu = CAN_MTU; return 0;
    case SIOCGIFTXQLEN: asked->ifr_qlen = 0; return 0;
    case SIOCGIFHWADDR:
        memset(&asked->ifr_hwaddr, 0, sizeof asked->ifr_hwaddr);
        asked->ifr_hwaddr.sa_family = ARPHRD_CAN;
        return 0;
    default: errno = EOPNOTSUPP; return -1; /* Like an interface without ethtool: no duplex, no speed. */
    }
}

unsigned if_nametoindex(const char *name) {
    typedef unsigned (*if_nametoindex_t)(const char *);
    int k = interface_of_name(name);
    return k >= 0 ? (unsigned)(FIRST_INDEX + k) : REAL(if_nametoindex_t, "if_nametoindex")(name);
}

char *if_indextoname(unsigned index, char name[IFNAMSIZ]) {
    typedef char *(*if_indextoname_t)(unsigned, char *);
    int k = interface_of_index((int)index);
    return k >= 0 ? memcpy(name, interfaces[k].name, IFNAMSIZ) : REAL(if_indextoname_t, "if_indextoname")(index, name);
}

/* The system's list, copied, with ours behind it. */
struct if_nameindex *if_nameindex(void) {
    typedef struct if_nameindex *(*if_nameindex_t)(void);
    typedef void (*if_freenameindex_t)(struct if_nameindex *);
    struct if_nameindex *theirs = REAL(if_nameindex_t, "if_nameindex")(), *all;
    size_t count = 0;
    while (theirs && theirs[count].if_name) count++;
    all = calloc(count + (size_t)interface_count + 1, sizeof *all);
    for (size_t k = 0; all && k < count; k++)
        all[k] = (struct if_nameindex){theirs[k].if_index, strdup(theirs[k].if_name)};
    for (int k = 0; all && k < interface_count; k++)
        all[count + (size_t)k] = (struct if_nameindex){(unsigned)(FIRST_INDEX + k), strdup(interfaces[k].name)};
    if (theirs) REAL(if_freenameindex_t, "if_freenameindex")(theirs);
    if (!all) errno = ENOBUFS;
    return all;
}

void if_freenameindex(struct if_nameindex *list) {
    for (struct if_nameindex *one = list; one && one->if_name; one++) free(one->if_name);
    free(list);
}

/* Entries of ours before those of the system; one block, so that it is known again when the list is given back. */
struct own_addresses {
    struct ifaddrs entries[INTERFACES];
    struct sockaddr_ll links[INTERFACES];
    struct own_addresses *next;
};

static struct own_addresses *given;
static pthread_mutex_t given_lock = PTHREAD_MUTEX_INITIALIZER;

int getifaddrs(struct ifaddrs **list) {
    typedef int (*getifaddrs_t)(struct ifaddrs **);
    int answer = REAL(getifaddrs_t, "getifaddrs")(list);
    if (answer < 0 || interface_count == 0) return answer;
    struct own_addresses *own = calloc(1, sizeof *own);
    if (!own) return 0;
    for (int k = 0; k < interface_count; k++) {
        struct sockaddr_ll *link = &own->links[k];
        link->sll_family = AF_PACKET;
        link->sll_ifindex = FIRST_INDEX + k;
        link->sll_hatype = ARPHRD_CAN;
        own->entries[k].ifa_name = interfaces[k].name;
        own->entries[k].ifa_flags = FLAGS;
        own->entries[k].ifa_addr = (struct sockaddr *)link;
        own->entries[k].ifa_next = k + 1 < interface_count ? &own->entries[k + 1] : *list;
    }
    *list = own->entries;
    pthread_mutex_lock(&given_lock);
    own->next = given;
    given = own;
    pthread_mutex_unlock(&given_lock);
    return 0;
}

void freeifaddrs(struct ifaddrs *list) {
    typedef void (*freeifaddrs_t)(struct ifaddrs *);
    pthread_mutex_lock(&given_lock);
    for (struct own_addresses **place = &given; *place; place = &(*place)->next) {
        struct own_addresses *own = *place;
        if (list != own->entries) continue;
        *place = own->next;
        list = own->entries[interface_count - 1].ifa_next;
        free(own);
        break;
    }
    pthread_mutex_unlock(&given_lock);
    if (list) REAL(freeifaddrs_t, "freeifaddrs")(list);
}

/* A copy of /proc/net/dev with our interfaces in it, as a descriptor without a name; the counters are not ours to know. */
static int open_counters(int source) {
    char line[512];
    int copy = memfd_create("net_dev", MFD_CLOEXEC);
    FILE *in = copy < 0 ? NULL : fdopen(dup(source), "r");
    if (!in) {
        if (copy >= 0) close(copy);
        return source;
    }
    while (fgets(line, sizeof line, in)) dprintf(copy, "%s", line);
    fclose(in);
    for (int k = 0; k < interface_count; k++)
        dprintf(copy, "%6s: 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n", interfaces[k].name);
    lseek(copy, 0, SEEK_SET);
    close(source);
    return copy;
}

static int with_counters(const char *path, int flags, int opened) {
    int ours = opened >= 0 && interface_count && path && strcmp(path, COUNTERS) == 0 && (flags & O_ACCMODE) == O_RDONLY;
    return ours ? open_counters(opened) : opened;
}

#define OPEN(name)                                                                                                     \
    int name(const char *path, int flags, ...) {                                                                       \
        typedef int (*open_t)(const char *, int, mode_t);                                                              \
        va_list arguments;                                                                                             \
        va_start(arguments, flags);                                                                                    \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;                                   \
        va_end(arguments);                                                                                             \
        return with_counters(path, flags, REAL(open_t, #name)(path, flags, mode));                                     \
    }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                                                                   \
    int name(int folder, const char *path, int flags, ...) {                                                           \
        typedef int (*openat_t)(int, const char *, int, mode_t);                                                       \
        va_list arguments;                                                                                             \
        va_start(arguments, flags);                                                                                    \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;                                   \
        va_end(arguments);                                                                                             \
        return with_counters(path, flags, REAL(openat_t, #name)(folder, path, flags, mode));                           \
    }
OPENAT(openat)
OPENAT(openat64)

#define FOPEN(name)                                                                                                    \
    FILE *name(const char *path, const char *mode) {                                                                   \
        typedef FILE *(*fopen_t)(const char *, const char *);                                                          \
        FILE *opened = REAL(fopen_t, #name)(path, mode);                                                               \
        if (!opened || !interface_count || !path || strcmp(path, COUNTERS) || strncmp(mode, "r", 1)) return opened;    \
        int copy = open_counters(dup(fileno(opened)));                                                                 \
        fclose(opened);                                                                                                \
        return fdopen(copy, "r");                                                                                      \
    }
FOPEN(fopen)
FOPEN(fopen64)
