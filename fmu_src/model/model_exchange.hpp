#pragma once

#include "model/model.hpp"

namespace redysim {

// Reason why a model does not support model exchange, one sentence; null if it does.
inline const char* objection_to_model_exchange(const Model& model) {
  for (const Contact& contact : model.contacts)
    if (contact.law == Contact::Law::redysim)
      return "no model exchange: the force of contacts with law = \"redysim\" jumps where they begin";
  return nullptr;
}

}  // namespace redysim
