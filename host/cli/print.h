/* print: results for people and, with --json, for programs. */
#ifndef PRINT_H
#define PRINT_H

#include "options.h"

void print_position(const command_line *line, const dryrig_position *position);
void print_info(const command_line *line, const dryrig_info *info, const dryrig_position *position);
void print_streamed(const command_line *line, const dryrig_position *position);
/* A command that has nothing to tell but that it is done. */
void print_done(const command_line *line);
/* An error; with the position where it is known (may be NULL). */
void print_error(const command_line *line, int error, const char *why, const dryrig_position *position);
/* Lists the ports. Returns an exit status. */
int print_ports(const command_line *line);

#endif
