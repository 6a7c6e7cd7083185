#include "target.h"

#include <stdio.h>

void target_put(int character) { (void)putchar(character); }
uint32_t target_work(void) { return 0; }
int main(void) { return target_main(); }
