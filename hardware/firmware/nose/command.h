/* Command parser, character by character; each command is answered by one sentence. */
#ifndef COMMAND_H
#define COMMAND_H

void command_character(char c);

#endif
