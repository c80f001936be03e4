// The EEPROM: 100,000 writes; each reset uses one.
#include "store.h"

#include <avr/eeprom.h>

#include "protocol.h"

struct stored {
    uint16_t boots;
    uint8_t serial_length; // erased memory reads 255: no serial number
    char serial[SERIAL_MAX];
};
static struct stored EEMEM stored;

uint16_t store_count_boot(void)
{
    uint16_t boots = eeprom_read_word(&stored.boots) + 1;
    eeprom_update_word(&stored.boots, boots);
    return boots;
}

uint8_t store_serial(char *out)
{
    uint8_t length = eeprom_read_byte(&stored.serial_length);
    if (length > SERIAL_MAX)
        return 0;
    eeprom_read_block(out, stored.serial, length);
    return length;
}

void store_set_serial(const char *serial, uint8_t length)
{
    eeprom_update_block(serial, stored.serial, length);
    eeprom_update_byte(&stored.serial_length, length);
}
