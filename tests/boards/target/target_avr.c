#include "target.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

void target_put(int character)
{
    while ((UCSR0A & _BV(UDRE0)) == 0) {}
    UDR0 = (uint8_t)character;
}

static volatile uint16_t wraps;
ISR(TIMER1_OVF_vect) { wraps++; }

uint32_t target_work(void)
{
    const uint8_t status = SREG;
    cli();
    uint16_t high = wraps;
    const uint16_t low = TCNT1;
    if ((TIFR1 & _BV(TOV1)) != 0 && low < 0x8000u)
        high++;
    SREG = status;
    return (uint32_t)high << 16 | low;
}

int main(void)
{
    UCSR0A = _BV(U2X0); /* 2 Mbaud: this is a simulator */
    UBRR0 = 0;
    UCSR0B = _BV(TXEN0);
    TCCR1B = _BV(CS10); /* counts every cycle */
    TIMSK1 = _BV(TOIE1);
    sei();
    const int result = target_main();
    while ((UCSR0A & _BV(UDRE0)) == 0) {}
    for (uint16_t i = 0; i < 1000; i++) /* the last byte leaves */
        __asm__ volatile("nop");
    GPIOR0 = (uint8_t)result;
    cli();
    sleep_enable();
    sleep_cpu(); /* without interrupts: the end, for simavr */
    return 0;
}
