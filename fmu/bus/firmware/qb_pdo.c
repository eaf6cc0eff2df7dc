/* PDO parameters with live mapping by SDO (CiA 301, 7.5.2.35 to 7.5.2.38): what may be written, and when. */
#include <string.h>

#include "qb_calls.h"

#define INVALID 0x80000000u
#define NO_REMOTE 0x40000000u
#define IDENTIFIER 0x1FFFFFFFu
#define SYNCHRONOUS_MAX 240
#define MOST_BYTES 8
#define MILLISECONDS QB_MILLISECOND
#define INHIBIT_UNIT (QB_MILLISECOND / 10)

enum { RPDO = 0x1400, TPDO = 0x1800, MAPPING = 0x200 };

int qb_pdo_exists(int node, uint16_t base, int number)
{
    qb_abort missing;
    return qb_find(node, (uint16_t)(base + number), 0, &missing) >= 0 || missing == QB_SUBINDEX_MISSING;
}

int qb_pdo_valid(const qb_pdo *pdo) { return !(pdo->cob_id & INVALID) && pdo->count > 0; }

/* Bytes of dummy objects, which an RPDO may map to skip some (CiA 301, 7.4.8.2), by their index. */
static int dummy_size(uint32_t index)
{
    static const uint8_t sizes[8] = {0, 0, 1, 2, 4, 1, 2, 4};
    return index < 8 ? sizes[index] : 0;
}

/* Bytes that a mapped object takes. */
static qb_abort size_of(int node, int receives, uint32_t entry, int *size)
{
    const uint16_t index = (uint16_t)(entry >> 16);
    const uint8_t subindex = (uint8_t)(entry >> 8);
    qb_abort missing;
    int row;
    if (dummy_size(index) > 0 && subindex == 0) {
        *size = dummy_size(index);
        return receives ? QB_FINE : QB_NOT_MAPPABLE;
    }
    row = qb_find(node, index, subindex, &missing);
    if (row < 0) {
        return missing;
    }
    *size = qb_row(node, row)->size;
    return qb_row(node, row)->flags & (receives ? QB_RECEIVABLE : QB_TRANSMITTABLE) ? QB_FINE : QB_NOT_MAPPABLE;
}

static qb_abort check_mappable(int node, int receives, uint32_t entry)
{
    int size = 0;
    const qb_abort refusal = size_of(node, receives, entry, &size);
    if (refusal != QB_FINE) {
        return refusal;
    }
    return size * 8 == (int)(entry & 0xFF) ? QB_FINE : QB_PDO_LENGTH_EXCEEDED;
}

static void take_entries(qb_network *net, int node, qb_pdo *pdo, uint16_t mapping, int count)
{
    int k;
    pdo->count = (uint8_t)(count > QB_ENTRIES ? QB_ENTRIES : count);
    for (k = 0; k < pdo->count; k++) {
        pdo->entries[k] = (uint32_t)qb_value(net, node, mapping, (uint8_t)(k + 1), 0);
    }
}

static void load(qb_network *net, int node, uint16_t base, int number, qb_pdo *pdo)
{
    const uint16_t communication = (uint16_t)(base + number), mapping = (uint16_t)(communication + MAPPING);
    pdo->cob_id = (uint32_t)qb_value(net, node, communication, 1, INVALID);
    pdo->type = (uint8_t)qb_value(net, node, communication, 2, 255);
    take_entries(net, node, pdo, mapping, (int)qb_value(net, node, mapping, 0, 0));
}

void qb_pdo_load(qb_network *net, int node)
{
    int k;
    for (k = 0; k < QB_PDOS; k++) {
        qb_pdo *rpdo = &net->nodes[node].rpdos[k], *tpdo = &net->nodes[node].tpdos[k];
        if (qb_pdo_exists(node, RPDO, k)) {
            load(net, node, RPDO, k, rpdo);
            rpdo->misfit = rpdo->missing = 0;
            qb_stop_timer(net, node, QB_T_RPDO + k);
            rpdo->period = qb_value(net, node, (uint16_t)(RPDO + k), 5, 0) * MILLISECONDS;
        }
        if (qb_pdo_exists(node, TPDO, k)) {
            load(net, node, TPDO, k, tpdo);
            tpdo->inhibit_time = qb_value(net, node, (uint16_t)(TPDO + k), 3, 0) * INHIBIT_UNIT;
            tpdo->event_timer = qb_value(net, node, (uint16_t)(TPDO + k), 5, 0) * MILLISECONDS;
            tpdo->sync_start = (int)qb_value(net, node, (uint16_t)(TPDO + k), 6, 0);
        }
    }
}

/* Binds the mapped objects anew where something was written since the last time. */
static void compile(qb_network *net, int node, int receives, int number)
{
    qb_node *me = &net->nodes[node];
    qb_pdo *pdo = receives ? &me->rpdos[number] : &me->tpdos[number];
    int k;
    if (!pdo->stale) {
        return;
    }
    pdo->stale = 0;
    pdo->length = 0;
    for (k = 0; k < pdo->count; k++) {
        int size = 0;
        if (size_of(node, receives, pdo->entries[k], &size) != QB_FINE || pdo->length + size > MOST_BYTES) {
            size = 0;
        }
        pdo->sizes[k] = (uint8_t)size;
        pdo->length = (uint8_t)(pdo->length + size);
    }
    if (receives) {
        qb_rpdo_compile(pdo);
    } else {
        qb_tpdo_compile(net, node, number);
    }
}

void qb_pdo_wire(qb_network *net, int node, int afresh)
{
    qb_node *me = &net->nodes[node];
    const int operational = me->state == QB_OPERATIONAL;
    int k;
    for (k = 0; k < QB_PDOS; k++) {
        me->rpdos[k].stale |= afresh;
        me->tpdos[k].stale |= afresh;
        if (afresh) {
            qb_stop_timer(net, node, QB_T_RPDO + k);
        }
        me->rpdos[k].wired = operational && qb_pdo_exists(node, RPDO, k) && qb_pdo_valid(&me->rpdos[k]);
        me->tpdos[k].wired = operational && qb_pdo_exists(node, TPDO, k) && qb_pdo_valid(&me->tpdos[k]);
    }
    for (k = 0; k < QB_PDOS; k++) {
        if (me->rpdos[k].wired) {
            compile(net, node, 1, k);
        }
    }
    for (k = 0; k < QB_PDOS; k++) {
        if (me->tpdos[k].wired) {
            compile(net, node, 0, k);
        }
    }
    for (k = 0; k < QB_PDOS; k++) {
        qb_tpdo_enable(net, node, k, me->tpdos[k].wired && me->tpdos[k].type >= 254);
    }
}

static void alter(qb_network *net, int node, qb_pdo *pdo)
{
    pdo->stale = 1;
    qb_pdo_wire(net, node, 0);
}

static qb_abort write_cob_id(qb_network *net, int node, qb_pdo *pdo, uint32_t value)
{
    const int goes_on = !(pdo->cob_id & INVALID) && !(value & INVALID);
    const qb_abort refusal = qb_check_cob_id(value);
    if (refusal != QB_FINE || (goes_on && ((pdo->cob_id ^ value) & IDENTIFIER))) {
        return QB_VALUE_RANGE_EXCEEDED;
    }
    pdo->cob_id = value;
    alter(net, node, pdo);
    return QB_FINE;
}

/* Types 252 and 253 are sent on remote request, where that is allowed. */
static qb_abort write_type(qb_network *net, int node, qb_pdo *pdo, int receives, uint8_t value)
{
    const int on_request = !receives && !(pdo->cob_id & NO_REMOTE);
    if (value > SYNCHRONOUS_MAX && value < 254 && !(on_request && value >= 252)) {
        return QB_VALUE_RANGE_EXCEEDED;
    }
    pdo->type = value;
    alter(net, node, pdo);
    return QB_FINE;
}

static qb_abort write_count(qb_network *net, int node, qb_pdo *pdo, int receives, uint16_t mapping, int count)
{
    qb_pdo wanted;
    int k, bits = 0;
    if (!(pdo->cob_id & INVALID)) {
        return QB_UNSUPPORTED_ACCESS;
    }
    if (count > QB_ENTRIES) {
        return QB_PDO_LENGTH_EXCEEDED;
    }
    take_entries(net, node, &wanted, mapping, count);
    for (k = 0; k < count; k++) {
        const qb_abort refusal = check_mappable(node, receives, wanted.entries[k]);
        if (refusal != QB_FINE) {
            return refusal;
        }
        bits += wanted.entries[k] & 0xFF;
    }
    if (bits > 8 * MOST_BYTES) {
        return QB_PDO_LENGTH_EXCEEDED;
    }
    pdo->count = (uint8_t)count;
    memcpy(pdo->entries, wanted.entries, sizeof pdo->entries[0] * (size_t)count);
    alter(net, node, pdo);
    return QB_FINE;
}

static qb_abort write_entry(qb_network *net, int node, const qb_pdo *pdo, int receives, uint16_t mapping, uint32_t entry)
{
    if (!(pdo->cob_id & INVALID) || qb_value(net, node, mapping, 0, 0) != 0) {
        return QB_UNSUPPORTED_ACCESS;
    }
    return entry ? check_mappable(node, receives, entry) : QB_FINE;
}

static qb_abort write_transmission(qb_network *net, int node, qb_pdo *pdo, uint8_t subindex, int64_t value)
{
    if (subindex == 5) {
        pdo->event_timer = value * MILLISECONDS;
        alter(net, node, pdo);
        return QB_FINE;
    }
    if (subindex != 3 && subindex != 6) {
        return QB_FINE;
    }
    if (!(pdo->cob_id & INVALID)) {
        return QB_DEVICE_STATE;
    }
    if (subindex == 3) {
        pdo->inhibit_time = value * INHIBIT_UNIT;
    } else if (value > SYNCHRONOUS_MAX) {
        return QB_VALUE_RANGE_EXCEEDED;
    } else {
        pdo->sync_start = (int)value;
    }
    return QB_FINE;
}

qb_abort qb_pdo_write(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t value)
{
    const int receives = index < TPDO, is_mapping = (index & MAPPING) != 0;
    const int number = index & 0x1FF;
    qb_node *me = &net->nodes[node];
    qb_pdo *pdo;
    if (number >= QB_PDOS) {
        return QB_FINE;
    }
    pdo = receives ? &me->rpdos[number] : &me->tpdos[number];
    if (is_mapping) {
        return subindex == 0 ? write_count(net, node, pdo, receives, index, (int)value)
                             : write_entry(net, node, pdo, receives, index, (uint32_t)value);
    }
    if (subindex == 1) {
        return write_cob_id(net, node, pdo, (uint32_t)value);
    }
    if (subindex == 2) {
        return write_type(net, node, pdo, receives, (uint8_t)value);
    }
    if (!receives) {
        return write_transmission(net, node, pdo, subindex, value);
    }
    if (subindex == 5) {
        qb_stop_timer(net, node, QB_T_RPDO + number);
        pdo->period = value * MILLISECONDS;
    }
    return QB_FINE;
}
