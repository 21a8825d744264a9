#pragma once

namespace redysim::drive {

// How often memory was asked for since the start, by any code in this process; -1 where that is not counted.
long allocations();

// Bytes of the heap that are in use now, as they were asked for; with sanitizers what the heap gave.
double heap_bytes();

}  // namespace redysim::drive
