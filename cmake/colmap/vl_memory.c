/* The two symbols that VLFeat's imopv.c wants of its generic.c, which pulls the rest of VLFeat. */
#include <stdlib.h>

void* vl_malloc(size_t size) { return malloc(size); }
void vl_free(void* pointer) { free(pointer); }
