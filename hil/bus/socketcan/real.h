/* The system's own function behind one of the same name here. */
#ifndef QUASIOMNI_REAL_H
#define QUASIOMNI_REAL_H

#include <dlfcn.h>

#define REAL(type, name) ((type)dlsym(RTLD_NEXT, name))

#endif
