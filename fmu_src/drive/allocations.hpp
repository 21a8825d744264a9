#pragma once

namespace redysim::drive {

// How often memory was asked for since the start, by any code in this process; -1 where that is not counted.
long allocations();

// Bytes of the heap in use now.
double heap_bytes();

}  // namespace redysim::drive
