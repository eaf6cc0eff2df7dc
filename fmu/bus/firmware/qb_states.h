/* The state machine of a drive (CiA 402-2), for what acts on it. */
#ifndef QB_STATES_H
#define QB_STATES_H

#include "qb_calls.h"

enum {
    NOT_READY_TO_SWITCH_ON = 0x00,
    SWITCH_ON_DISABLED = 0x40,
    READY_TO_SWITCH_ON = 0x21,
    SWITCHED_ON = 0x23,
    OPERATION_ENABLED = 0x27,
    QUICK_STOP_ACTIVE = 0x07,
    FAULT_REACTION_ACTIVE = 0x0F,
    FAULT = 0x08
};

typedef enum { NO_COMMAND, SHUTDOWN, SWITCH_ON, ENABLE_OPERATION, DISABLE_VOLTAGE, QUICK_STOP, FAULT_RESET } qb_command;

/* Ways of stopping: values of 605Eh, of 605Ah up to 4. */
enum { DISABLE, SLOW_DOWN };

/* Takes a transition by its number in the state diagram, if it begins in the present state; 13 from everywhere. */
void qb_drive_take(qb_network *net, int node, int number);
/* What a command of the controlword does in the present state. */
void qb_drive_command(qb_network *net, int node, qb_command given);
void qb_drive_update_status(qb_network *net, int node);
void qb_drive_forget_setpoints(qb_drive *me);
void qb_drive_run(qb_network *net, int node, qb_motion motion);
/* Moves as the mode of operation says. */
void qb_drive_operate(qb_network *net, int node);
/* Option code of a transition that a ramp may come before, zero where none does. */
uint16_t qb_drive_option_before(int number);
int qb_drive_operates(const qb_drive *me);
int qb_drive_is_faulty(const qb_drive *me);

#endif
