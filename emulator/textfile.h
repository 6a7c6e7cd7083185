/* textfile: a file of text, as a whole.
 *
 * Thread-safety: one thread. */
#ifndef TEXTFILE_H
#define TEXTFILE_H

/* The caller frees it. NULL: textfile_why() tells. */
char *textfile_read(const char *path);
/* What the last one that could not be read suffers from. */
const char *textfile_why(void);

/* Where `word` stands in a line (from 1), else where its first word does; for messages. */
unsigned textfile_column(const char *text, unsigned line, const char *word);

#endif
