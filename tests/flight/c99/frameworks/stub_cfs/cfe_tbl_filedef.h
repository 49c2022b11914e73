/* A stub of cFE's header of this name: it keeps how long the table is. */
#ifndef CFE_TBL_FILEDEF_STUB_H
#define CFE_TBL_FILEDEF_STUB_H
#include "cfe.h"
typedef struct {
    const char *ObjectName;
    const char *TableName;
    const char *Description;
    const char *TgtFilename;
    uint32 ObjectSize;
} CFE_TBL_FileDef_t;
extern CFE_TBL_FileDef_t CFE_TBL_FileDef;
#define CFE_TBL_FILEDEF(ObjName, TblName, Desc, Filename) \
    CFE_TBL_FileDef_t CFE_TBL_FileDef = {#ObjName, #TblName, #Desc, #Filename, sizeof(ObjName)};
#endif
