#include "lib/config/toml_file.h"
