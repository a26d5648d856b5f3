//! x
use lamc::{backend::rust, pipeline, source::SourceFile};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let f = SourceFile::read(&a[1]).unwrap();
    let t = std::time::Instant::now();
    match pipeline::compile(&f) {
        Ok(c) => {
            eprint!("{}", c.warnings.render(&f, false));
            eprintln!(
                "{:?} mobility {} {:?}",
                t.elapsed(),
                c.topology.mobility,
                c.topology.summary_lines()
            );
            let s = pipeline::rust_module(&c, &rust::Options::default());
            eprintln!("{:?} {}", t.elapsed(), s.len());
            print!("{s}");
        }
        Err(pipeline::CompileError::Model(d)) => eprint!("{}", d.render(&f, false)),
        Err(e) => eprintln!("{e}"),
    }
}
