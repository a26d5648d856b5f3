//! What the runtime does with the equations: assembly, integration, rest, modes, stops, singular
//! states.

mod assembly;
mod equilibria;
mod long_run;
mod methods;
mod modes;
mod singular;
mod stiff;
mod stops;
