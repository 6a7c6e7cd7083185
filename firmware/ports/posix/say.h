/* say: words for people at stderr, from a program that must not be held up: what a terminal or pipe does not take now is
 * not said. Thread-safety: any thread, after a first call. */
#ifndef SAY_H
#define SAY_H

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
void say(const char *format, ...);

#endif
