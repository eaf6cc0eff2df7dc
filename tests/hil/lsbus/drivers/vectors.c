/* The macros of FMI-LS-BUS 1.0.0 as a program: `write` prints each operation, as hexadecimal numbers, a line each;
 * `read` takes the bytes of a binary variable in hexadecimal and prints the operations that the macros find in it. */
#include <stdio.h>
#include <string.h>

#include "fmi3LsBusUtilCan.h"

static fmi3UInt8 buffer[1 << 16];

static void print(fmi3LsBusUtilBufferInfo *info)
{
    size_t i;
    for (i = 0; i < FMI3_LS_BUS_BUFFER_LENGTH(info); i++) {
        printf("%02x", FMI3_LS_BUS_BUFFER_START(info)[i]);
    }
    printf("\n");
    FMI3_LS_BUS_BUFFER_INFO_RESET(info);
}

static void write_all(fmi3LsBusUtilBufferInfo *info)
{
    static const fmi3UInt8 data[8] = {'A', 'B', 'C', 'D', 'A', 'B', 'C', 'D'};
    FMI3_LS_BUS_CAN_CREATE_OP_CAN_TRANSMIT(info, 0, 0, 0, sizeof data, data);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_CAN_TRANSMIT(info, UINT32_MAX, 1, 1, sizeof data, data);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_CAN_TRANSMIT(info, 0x601, 0, 0, 3, data);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_CAN_TRANSMIT(info, 0x701, 0, 1, 0, data);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_CAN_FD_TRANSMIT(info, 1, 0, 1, 0, sizeof data, data);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_CAN_XL_TRANSMIT(info, 1, 0, 1, 0, 0, 7, sizeof data, data);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_CONFIRM(info, 0x601);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_ARBITRATION_LOST(info, 0x601);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_BUS_ERROR(info, 0x601, FMI3_LS_BUS_CAN_BUSERROR_PARAM_ERROR_CODE_ACK_ERROR,
                                        FMI3_LS_BUS_CAN_BUSERROR_PARAM_ERROR_FLAG_PRIMARY_ERROR_FLAG, 1);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_CONFIGURATION_CAN_BAUDRATE(info, 1000000);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_CONFIGURATION_ARBITRATION_LOST_BEHAVIOR(
        info, FMI3_LS_BUS_CAN_CONFIG_PARAM_ARBITRATION_LOST_BEHAVIOR_BUFFER_AND_RETRANSMIT);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_STATUS(info, FMI3_LS_BUS_CAN_STATUS_PARAM_STATUS_KIND_ERROR_PASSIVE);
    print(info);
    FMI3_LS_BUS_CAN_CREATE_OP_WAKEUP(info);
    print(info);
    FMI3_LS_BUS_CREATE_OP_FORMAT_ERROR(info, 3, data);
    print(info);
}

static void show(const fmi3LsBusOperationHeader *header)
{
    const fmi3LsBusCanOperationCanTransmit *frame = (const fmi3LsBusCanOperationCanTransmit *)header;
    const fmi3LsBusCanOperationConfiguration *told = (const fmi3LsBusCanOperationConfiguration *)header;
    int i;
    if (header->opCode == FMI3_LS_BUS_CAN_OP_CONFIGURATION) {
        printf("configuration %d %lu\n", told->parameterType,
               told->parameterType == FMI3_LS_BUS_CAN_CONFIG_PARAM_TYPE_CAN_BAUDRATE
                   ? (unsigned long)told->baudrate
                   : (unsigned long)told->arbitrationLostBehavior);
    } else if (header->opCode == FMI3_LS_BUS_CAN_OP_CAN_TRANSMIT) {
        printf("frame %x %d %d ", (unsigned)frame->id, frame->ide, frame->rtr);
        for (i = 0; i < frame->dataLength; i++) {
            printf("%02x", frame->data[i]);
        }
        printf("\n");
    } else {
        printf("operation %x\n", (unsigned)header->opCode);
    }
}

int main(int count, char **arguments)
{
    fmi3LsBusUtilBufferInfo info;
    fmi3LsBusOperationHeader *header = NULL;
    unsigned byte;
    FMI3_LS_BUS_BUFFER_INFO_INIT(&info, buffer, sizeof buffer);
    if (count > 1 && strcmp(arguments[1], "write") == 0) {
        write_all(&info);
        return 0;
    }
    while (scanf("%2x", &byte) == 1) {
        *info.writePos++ = (fmi3UInt8)byte;
    }
    while (FMI3_LS_BUS_READ_NEXT_OPERATION(&info, header)) {
        show(header);
    }
    return info.status == fmi3True ? 0 : 1;
}
