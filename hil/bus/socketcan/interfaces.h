/* The CAN interfaces that QUASIOMNI_CAN names, and the hubs behind them. */
#ifndef QUASIOMNI_INTERFACES_H
#define QUASIOMNI_INTERFACES_H

/* How many there are. */
int interfaces_known(void);

/* Number of an interface by its system-wide index or its name; -1 where it is not one of these. */
int interface_of_index(int index);
int interface_of_name(const char *name);

/* System-wide index, and path of the hub, of an interface by its number. */
int interface_index(int number);
const char *interface_path(int number);

/* Answers an ioctl about an interface: 0, -1 with errno set, or 1 where it is none of these, or another question. */
int interface_ioctl(unsigned long request, void *argument);

#endif
