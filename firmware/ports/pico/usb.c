/* What the board tells the computer it is. */
#include "pico/unique_id.h"
#include "tusb.h"

enum { LANGUAGE, MANUFACTURER, PRODUCT, SERIAL_NUMBER, STRINGS };
enum { NOTIFY_IN = 0x81, DATA_OUT = 0x02, DATA_IN = 0x82 };

static const tusb_desc_device_t device = {
    .bLength = sizeof device,
    .bDescriptorType = TUSB_DESC_DEVICE,
    .bcdUSB = 0x0200,
    .bDeviceClass = TUSB_CLASS_MISC,
    .bDeviceSubClass = MISC_SUBCLASS_COMMON,
    .bDeviceProtocol = MISC_PROTOCOL_IAD,
    .bMaxPacketSize0 = CFG_TUD_ENDPOINT0_SIZE,
    .idVendor = 0x2E8A,  /* Raspberry Pi, */
    .idProduct = 0x000A, /* a serial port of a program made with the Pico SDK */
    .bcdDevice = 0x0100,
    .iManufacturer = MANUFACTURER,
    .iProduct = PRODUCT,
    .iSerialNumber = SERIAL_NUMBER,
    .bNumConfigurations = 1,
};

#define LENGTH (TUD_CONFIG_DESC_LEN + TUD_CDC_DESC_LEN)
static const uint8_t configuration[] = {TUD_CONFIG_DESCRIPTOR(1, 2, 0, LENGTH, 0, 100),
                                        TUD_CDC_DESCRIPTOR(0, 0, NOTIFY_IN, 8, DATA_OUT, DATA_IN, 64)};

const uint8_t *tud_descriptor_device_cb(void) { return (const uint8_t *)&device; }

const uint8_t *tud_descriptor_configuration_cb(uint8_t index)
{
    (void)index;
    return configuration;
}

const uint16_t *tud_descriptor_string_cb(uint8_t index, uint16_t language)
{
    static uint16_t descriptor[32];
    static char serial_number[2 * PICO_UNIQUE_BOARD_ID_SIZE_BYTES + 1];
    static const char *const strings[STRINGS] = {"\x09\x04", "Dryrig", USB_PRODUCT, serial_number};
    uint8_t count = 0;
    (void)language;
    if (index >= STRINGS)
        return NULL;
    if (index == LANGUAGE) {
        descriptor[++count] = 0x0409;
    } else {
        if (index == SERIAL_NUMBER)
            pico_get_unique_board_id_string(serial_number, sizeof serial_number);
        while (strings[index][count] != '\0' && count < 31) {
            descriptor[count + 1] = (uint8_t)strings[index][count];
            count++;
        }
    }
    descriptor[0] = (uint16_t)(TUSB_DESC_STRING << 8 | (2 * count + 2));
    return descriptor;
}
