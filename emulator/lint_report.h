/* lint_report: what the lint has found, for people, for programs (JSON) and for CI servers (JUnit XML).
 *
 * Thread-safety: one thread at a time per lint and file. */
#ifndef LINT_REPORT_H
#define LINT_REPORT_H

#include "lint.h" /* the findings */

#include <stdio.h>

#define LINT_SHOWN 10u /* of each rule, for people; programs get all */

/* Each is false where the file cannot be written. */
bool lint_report_text(const lint *l, FILE *file); /* nothing where nothing was found */
bool lint_report_json(const lint *l, FILE *file);
bool lint_report_junit(const lint *l, FILE *file);

#endif
