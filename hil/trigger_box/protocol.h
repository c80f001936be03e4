// Protocol constants shared by host and trigger box. Twin of crates/drivers/trigger_box/src/protocol.rs.
#pragma once

#define FIRMWARE_MAJOR 1
#define FIRMWARE_MINOR 1
#define FIRMWARE_PATCH 1

// Changes with any change of a frame's meaning. The layout of HELLO never changes.
#define PROTOCOL_VERSION 2
#define BOX_NAME "skinrig-trigger-box"

#define BAUD_RATE 250000UL

// Body of a frame without checksum.
#define MAX_BODY 112
#define SERIAL_MAX 16
#define EVENTS_PER_REPLY 6

enum command {
    COMMAND_HELLO = 0x01,
    COMMAND_ARM = 0x02,
    COMMAND_DISARM = 0x03,
    COMMAND_MARK = 0x04,
    COMMAND_SYNC = 0x05,
    COMMAND_EVENTS = 0x06,
    COMMAND_STATUS = 0x07,
    COMMAND_SELF_TEST = 0x08,
    COMMAND_TIME = 0x09,
    COMMAND_SET_SERIAL = 0x0A,
};
#define REPLY 0x80

enum result {
    RESULT_OK = 0,
    RESULT_UNKNOWN_COMMAND = 1,
    RESULT_BAD_ARGUMENT = 2,
    RESULT_NOT_ARMED = 3,
    RESULT_BUSY = 4,
    RESULT_OUT_OF_ORDER = 5,
    RESULT_BAD_VERSION = 6,
    RESULT_ARMED = 7,
};

enum event_kind {
    EVENT_MARK = 1,
    EVENT_SYNC = 2,
    EVENT_INPUT_FELL = 3,
    EVENT_INPUT_ROSE = 4,
};

enum status_flag {
    FLAG_ARMED = 1 << 0,
    FLAG_SYNC = 1 << 1,
    FLAG_TRAIN = 1 << 2,
    FLAG_DISARMED_BY_SILENCE = 1 << 3,
    FLAG_INPUT_HIGH = 1 << 4,
};

enum self_test_flag {
    SELF_TEST_ROSE = 1 << 0,
    SELF_TEST_FELL = 1 << 1,
    SELF_TEST_INPUT_FOLLOWED = 1 << 2,
};
