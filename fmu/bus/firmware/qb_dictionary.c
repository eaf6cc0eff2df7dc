/* The object dictionary of a node: rows of the EDS, values that live elsewhere, and who may refuse one. */
#include "qb_calls.h"

const qb_object *qb_row(int node, int row) { return &qb_devices[qb_places[node].device].objects[row]; }

int qb_find(int node, uint16_t index, uint8_t subindex, qb_abort *missing)
{
    const qb_device *device = &qb_devices[qb_places[node].device];
    const uint32_t key = (uint32_t)index << 8 | subindex;
    int low = 0, high = device->count - 1;
    *missing = QB_OBJECT_MISSING;
    while (low <= high) {
        const int middle = (low + high) / 2;
        const qb_object *row = &device->objects[middle];
        const uint32_t found = (uint32_t)row->index << 8 | row->subindex;
        if (row->index == index) {
            *missing = QB_SUBINDEX_MISSING;
        }
        if (found == key) {
            return middle;
        }
        if (found < key) {
            low = middle + 1;
        } else {
            high = middle - 1;
        }
    }
    if (low < device->count && device->objects[low].index == index) {
        *missing = QB_SUBINDEX_MISSING;
    }
    if (low > 0 && device->objects[low - 1].index == index) {
        *missing = QB_SUBINDEX_MISSING;
    }
    return -1;
}

void qb_restore(qb_network *net, int node, uint16_t last)
{
    const qb_device *device = &qb_devices[qb_places[node].device];
    int row;
    for (row = 0; row < device->count && device->objects[row].index <= last; row++) {
        const qb_object *object = &device->objects[row];
        net->nodes[node].values[row] = object->start + (object->flags & QB_OF_NODE ? qb_places[node].id : 0);
    }
}

/* Values that the services of CiA 301 keep; zero where the dictionary has it. */
static int service_read(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t *value, qb_abort *abort)
{
    const qb_emergency *emergency = &net->nodes[node].emergency;
    if (index == 0x1001) {
        *value = qb_error_register(net, node);
        return 1;
    }
    if (index != 0x1003) {
        return 0;
    }
    if (subindex == 0) {
        *value = emergency->known;
    } else if (subindex <= emergency->known) {
        *value = emergency->history[subindex - 1];
    } else {
        *abort = QB_NO_DATA;
    }
    return 1;
}

qb_abort qb_read(qb_network *net, int node, int row, int64_t *value)
{
    const qb_object *object = qb_row(node, row);
    qb_abort abort = QB_FINE;
    if (!service_read(net, node, object->index, object->subindex, value, &abort) &&
        !qb_profile_read(net, node, object->index, object->subindex, value)) {
        *value = net->nodes[node].values[row];
    }
    return abort;
}

int64_t qb_value(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t otherwise)
{
    qb_abort missing;
    int64_t value = otherwise;
    const int row = qb_find(node, index, subindex, &missing);
    if (row >= 0) {
        qb_read(net, node, row, &value);
    }
    return value;
}

qb_abort qb_check(int node, int row, int64_t value)
{
    const qb_object *object = qb_row(node, row);
    if (value > object->maximum) {
        return QB_VALUE_TOO_HIGH;
    }
    return value < object->minimum ? QB_VALUE_TOO_LOW : QB_FINE;
}

qb_abort qb_write(qb_network *net, int node, int row, int64_t value)
{
    const qb_object *object = qb_row(node, row);
    const uint16_t index = object->index;
    qb_abort abort;
    if (index >= 0x1400 && index < 0x1C00) {
        abort = qb_pdo_write(net, node, index, object->subindex, value);
    } else if (index < 0x2000) {
        abort = qb_node_write(net, node, index, object->subindex, value);
    } else {
        abort = qb_profile_write(net, node, index, value);
    }
    if (abort == QB_FINE) {
        net->nodes[node].values[row] = value;
        qb_profile_changed(net, node, index);
    }
    return abort;
}

/* A PDO has no way to answer: a refused value leaves the object as it is. */
void qb_write_by_pdo(qb_network *net, int node, int row, int64_t value)
{
    if (!qb_profile_write_by_pdo(net, node, qb_row(node, row)->index, value) && qb_check(node, row, value) == QB_FINE) {
        qb_write(net, node, row, value);
    }
}

int64_t qb_unpack(const uint8_t *data, int size, int is_signed)
{
    uint64_t value = 0;
    int i;
    for (i = size - 1; i >= 0; i--) {
        value = value << 8 | data[i];
    }
    if (is_signed && size < 8 && value >> (8 * size - 1) & 1) {
        return (int64_t)value - ((int64_t)1 << (8 * size));
    }
    return (int64_t)value;
}

void qb_pack(uint8_t *data, int size, int64_t value)
{
    int i;
    for (i = 0; i < size; i++) {
        data[i] = (uint8_t)((uint64_t)value >> (8 * i));
    }
}
