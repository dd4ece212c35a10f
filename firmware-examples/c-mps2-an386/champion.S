/* The policy's file, in flash; the library reads it at any alignment. */
  .section .rodata.champion, "a"
  .global champion, champion_end
champion:
  .incbin CHAMPION
champion_end:
/* No code here needs the stack to be executable. */
  .section .note.GNU-stack, "", %progbits
