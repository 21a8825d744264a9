#pragma once

namespace redysim::bench {

// How often memory was asked for since the start, by any code in this process.
long allocations();

// Bytes of the heap that are in use now, as they were asked for.
double heap_bytes();

}  // namespace redysim::bench
