/* A serial port, by libserialport. */
#include "link.h"

#include <libserialport.h>

#include <errno.h>
#include <stdio.h>

static int serial_read(void *context, void *bytes, size_t room, uint32_t timeout_us)
{
    /* 0 ms would be for ever */
    const enum sp_return count = timeout_us == 0
                                     ? sp_nonblocking_read(context, bytes, room)
                                     : sp_blocking_read_next(context, bytes, room, (timeout_us + 999u) / 1000u);
    return count >= 0 ? (int)count : DRYRIG_ERR_LINK;
}

static int serial_write(void *context, const void *bytes, size_t count)
{
    const enum sp_return written = sp_blocking_write(context, bytes, count, WRITE_LIMIT_MS);
    return written >= 0 && (size_t)written == count && sp_drain(context) == SP_OK ? 0 : DRYRIG_ERR_LINK;
}

static int serial_purge(void *context) { return sp_flush(context, SP_BUF_INPUT) == SP_OK ? 0 : DRYRIG_ERR_LINK; }

static void serial_close(void *context)
{
    (void)sp_close(context);
    sp_free_port(context);
}

int link_serial_descriptor(const dryrig_link *link)
{
    int fd = -1;
    return link->close == serial_close && sp_get_port_handle(link->context, &fd) == SP_OK ? fd : -1;
}

static int failed(const char *path, const char *doing, char *why, size_t room)
{
    char *message = sp_last_error_message();
    (void)snprintf(why, room, "%.200s: cannot %s: %.200s", path, doing, message != NULL ? message : "no reason given");
    sp_free_error_message(message);
    return DRYRIG_ERR_PORT;
}

int link_serial_open(dryrig_link *out, const char *path, unsigned baud, char *why, size_t room)
{
    struct sp_port *port = NULL;
    const enum sp_return found = sp_get_port_by_name(path, &port);
    if (found == SP_ERR_MEM)
        return DRYRIG_ERR_MEMORY;
    if (found == SP_ERR_ARG) {
        (void)snprintf(why, room, "%.200s is not a serial port of this machine; 'dryrig ports' lists them", path);
        return DRYRIG_ERR_PORT;
    }
    if (found != SP_OK)
        return failed(path, "find it", why, room);
    if (sp_open(port, SP_MODE_READ_WRITE) != SP_OK) {
        const int result =
            sp_last_error_code() == EBUSY ? link_busy(path, why, room) : failed(path, "open it", why, room);
        sp_free_port(port);
        return result;
    }
    int fd = -1, result = DRYRIG_OK;
    if (sp_get_port_handle(port, &fd) == SP_OK && link_lock(fd) != DRYRIG_OK)
        result = link_busy(path, why, room);
    else if (sp_set_baudrate(port, (int)baud) != SP_OK || sp_set_bits(port, 8) != SP_OK ||
             sp_set_parity(port, SP_PARITY_NONE) != SP_OK || sp_set_stopbits(port, 1) != SP_OK ||
             sp_set_flowcontrol(port, SP_FLOWCONTROL_NONE) != SP_OK)
        result = failed(path, "set the line", why, room);
    if (result != DRYRIG_OK) {
        serial_close(port);
        return result;
    }
    *out = (dryrig_link){port, serial_read, serial_write, serial_purge, link_now_us, link_sleep_us, serial_close};
    return DRYRIG_OK;
}

int dryrig_list_ports(void (*each)(void *context, const char *path, const char *description), void *context)
{
    struct sp_port **ports;
    if (each == NULL)
        return DRYRIG_ERR_ARGUMENT;
    const enum sp_return result = sp_list_ports(&ports);
    if (result != SP_OK)
        return result == SP_ERR_MEM ? DRYRIG_ERR_MEMORY : DRYRIG_ERR_PORT;
    for (size_t i = 0; ports[i] != NULL; i++) {
        const char *description = sp_get_port_description(ports[i]);
        each(context, sp_get_port_name(ports[i]), description != NULL ? description : "");
    }
    sp_free_port_list(ports);
    return DRYRIG_OK;
}
