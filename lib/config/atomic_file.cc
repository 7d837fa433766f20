#include "lib/config/atomic_file.h"
