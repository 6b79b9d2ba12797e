// Makes the contacts of hair against hair for an instruction set.
#pragma once
#include <memory>

#include "kernels/backend/host.h"
#include "kernels/contact/hair_contacts.h"
#include "kernels/launch/launch.h"

namespace ringlet::kernels {

// For T = float or double, on the CPU.
template <class T>
std::unique_ptr<HairContacts<T>> make_hair_contacts(InstructionSet set, HostThreads threads);

}  // namespace ringlet::kernels
